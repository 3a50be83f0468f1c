#include <chrono>
#include "drv.hpp"
struct Clock{std::chrono::steady_clock::time_point t=std::chrono::steady_clock::now();~Clock(){double x=std::chrono::duration<double>(std::chrono::steady_clock::now()-t).count();if(x>5)std::printf("   [%.1f s]\n",x);}};
void setrate(Scene& s,const Structure& S,double per=0.4){s.rate=std::clamp(S.omega.maxCoeff()/per,20*lowest_of(S)/6.28,20000.0);}
std::string S(double x){char b[40];std::snprintf(b,40,"%.4g",x);return b;}
double size_of(const Structure& s){return s.mass_properties.r.colwise().norm().maxCoeff();}
Scene straight(int n,double k,double kb,unsigned seed){std::mt19937 g(seed);std::uniform_real_distribution<double>u(-1,1);Scene s;s.name="s";
  for(int i=0;i<n;++i)point(s,std::exp(0.4*u(g)),Vector3d(i,0,0));
  for(int i=0;i+1<n;++i)link(s,{i,i+1},Spring{k});for(int i=0;i+2<n;++i)link(s,{i,i+1,i+2},BendingSpring{kb});publish_all(s);return s;}
TEST(C,dyn){for(unsigned seed:{0u,1u,2u})for(double k:{1100.,1200.,1300.,1900.})for(double f:{3e-5,1e-4,3e-4}){
    Scene s=straight(4,k,100,seed);auto S_=st(s);int a=S_->mechanisms.size();setrate(s,*S_);double w1=S_->omega[a];
    add_mode(s,*S_,a,2e-4,0);Load L;L.axes=Axes::kBody;double F=f*k;L.forces={{0,Vector3d(F,0,0)},{3,Vector3d(-F,0,0)}};L.history=SineHistory{2*w1/2/M_PI,M_PI/2};s.loads={L};
    study("dyn seed"+S(seed)+" k"+S(k)+" f"+S(f),s,25*2*M_PI/w1,{Fidelity::kSeparated},25);}}
// rigid torque and thrust that pulsate at the sum or difference of two frequencies
TEST(C,torque){for(unsigned seed:{0u,1u,2u})for(double f:{0.003,0.01})for(int sum:{0,1}){Clock c;
    std::mt19937_64 g(seed+7);std::uniform_real_distribution<double>u(-1,1);Scene s;s.name="cl";int n=6;
    while((int)s.points.size()<n){Vector3d p(1.5*u(g),0.8*u(g),0.6*u(g));bool ok=true;for(auto&q:s.points)ok=ok&&(q.position-p).norm()>0.6;if(ok)point(s,std::exp(0.7*u(g)),p);}
    for(int a=0;a<n;++a)for(int b=a+1;b<n;++b)link(s,{a,b},Spring{std::exp(8+u(g))});publish_all(s);
    auto S_=st(s);setrate(s,*S_);double w1=S_->omega[0];double z=size_of(*S_);
    add_mode(s,*S_,0,1e-3*z,0);add_mode(s,*S_,1,1e-3*z,0);double Om=sum?S_->omega[0]+S_->omega[2]:S_->omega[1]-S_->omega[0];
    Load L;L.axes=Axes::kBody;double F=f*S_->mass_properties.mass*w1*w1*z;Vector3d d(u(g),u(g),u(g));L.forces={{0,F*d}};L.history=SineHistory{Om/2/M_PI,0};s.loads={L};s.tolerance=1e-3*z;
    study("torque seed"+S(seed)+" f"+S(f)+" sum"+S(sum),s,40*2*M_PI/w1,{Fidelity::kSeparated,Fidelity::kCoupled},25);}}
// more than 48 modes below a local one under load
TEST(C,local){for(double F:{0.02,0.1,0.3}){Clock c;Scene s;s.name="local";
    // soft heavy cloud of 18 points, and a small stiff light strut that is compressed
    std::mt19937_64 g(3);std::uniform_real_distribution<double>u(-1,1);
    while((int)s.points.size()<19){Vector3d p(3*u(g),3*u(g),3*u(g));bool ok=true;for(auto&q:s.points)ok=ok&&(q.position-p).norm()>0.9;if(ok)point(s,5,p);}
    for(int a=0;a<19;++a)for(int b=a+1;b<19;++b)link(s,{a,b},Spring{100*std::exp(u(g))});
    // strut: heavy ends tied to the cloud, middle light
    int A=0,B=1;Vector3d pa=s.points[A].position,pb=s.points[B].position;
    int m1=point(s,0.05,0.5*(pa+pb));double Ls=(pb-pa).norm();
    link(s,{A,m1},Spring{1e5});link(s,{m1,B},Spring{1e5});link(s,{A,m1,B},BendingSpring{40});publish_all(s);
    auto S_=st(s);int nm=S_->omega.size();std::printf("modes %d, w: ",nm);for(int q=0;q<nm;q+=6)std::printf("%g ",S_->omega[q]);
    int lm=-1;double best=0;for(int q=0;q<nm;++q){double v=S_->shapes.block<3,1>(3*m1,q).norm();Vector3d ax=(pb-pa).normalized();double tr=(S_->shapes.block<3,1>(3*m1,q)-ax*ax.dot(S_->shapes.block<3,1>(3*m1,q))).norm();if(tr>best){best=tr;lm=q;}}
    std::printf(" local mode %d w %g L %g\n",lm,S_->omega[lm],Ls);setrate(s,*S_,0.8);
    add_mode(s,*S_,lm,2e-4,0);Load L;L.axes=Axes::kBody;double Fc=F*4*40/Ls;Vector3d ax=(pb-pa).normalized();L.forces={{A,Fc*ax},{B,-Fc*ax}};s.loads={L};
    // static so that only the local mode rings
    {Eigen::VectorXd Q=Eigen::VectorXd::Zero(nm);for(int q=0;q<nm;++q){double x=Fc*ax.dot(S_->shapes.block<3,1>(3*A,q)-S_->shapes.block<3,1>(3*B,q))/(S_->mass_properties.mass*S_->omega[q]*S_->omega[q]);add_mode(s,*S_,q,x,0);}}
    s.tolerance=2e-4;
    study("local F"+S(F),s,6*2*M_PI/S_->omega[lm],{Fidelity::kSeparated,Fidelity::kExactBars},20);}}
// a free hinge: mechanism that swings
TEST(C,hinge){for(double sw:{1e-3,1e-2,0.1})for(int ld:{0,1}){Clock c;Scene s;s.name="h";
    for(int i=0;i<5;++i)point(s,1+0.3*i,Vector3d(i,i==2?0.1:0,0.05*i*i));
    for(int i=0;i<4;++i){Beam b{.EA=3e4,.GJ=200,.EI_y=300,.EI_z=400,.y_axis=Vector3d(0.1,0.2,1)};if(i==1)b.released[1]={false,true,false};link(s,{i,i+1},b);}
    publish_all(s);auto S_=st(s);int a=S_->mechanisms.size();double w1=lowest_of(*S_);setrate(s,*S_);
    std::printf("mech %d w1 %g\n",a,w1);
    add_mode(s,*S_,a,1e-3,0);for(int q=0;q<a;++q)add_mode(s,*S_,q,0,sw*w1*0.1);
    if(ld){Load L;L.axes=Axes::kWorld;L.forces={{4,Vector3d(0.01,0.02,0.1)*w1*w1*0.01}};s.loads={L};}
    study("hinge sw"+S(sw)+" ld"+S(ld),s,10*2*M_PI/w1,{Fidelity::kSeparated,Fidelity::kSpinLoaded,Fidelity::kCoupled},25);}}
TEST(Z,tally){std::printf("TALLY scenes %d runs %d runs with false %d words %d good %d false %d silly runs %d\n",tally.scenes,tally.runs,tally.runs_fg,tally.words,tally.good,tally.false_good,tally.silly);}
