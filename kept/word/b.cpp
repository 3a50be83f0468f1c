#include <chrono>
#include "drv.hpp"
struct Clock{std::chrono::steady_clock::time_point t=std::chrono::steady_clock::now();~Clock(){std::printf("   [%.1f s]\n",std::chrono::duration<double>(std::chrono::steady_clock::now()-t).count());}};
void setrate(Scene& s,const Structure& S,double per=0.4){s.rate=std::clamp(S.omega.maxCoeff()/per,20*lowest_of(S)/6.28,20000.0);}
Scene straight(int n,double k,double kb,unsigned seed){std::mt19937 g(seed);std::uniform_real_distribution<double>u(-1,1);Scene s;s.name="s";
  for(int i=0;i<n;++i)point(s,std::exp(0.4*u(g)),Vector3d(i,0,0));
  for(int i=0;i+1<n;++i)link(s,{i,i+1},Spring{k});for(int i=0;i+2<n;++i)link(s,{i,i+1,i+2},BendingSpring{kb});publish_all(s);return s;}
Scene cloud(int n,unsigned seed,double lo=1e3,double hi=1e4){std::mt19937_64 g(seed);std::uniform_real_distribution<double>u(-1,1);Scene s;s.name="cl";
  while((int)s.points.size()<n){Vector3d p(1.5*u(g),0.8*u(g),0.6*u(g));bool ok=true;for(auto&q:s.points)ok=ok&&(q.position-p).norm()>0.6;if(ok)point(s,std::exp(0.7*u(g)),p);}
  for(int a=0;a<n;++a)for(int b=a+1;b<n;++b)link(s,{a,b},Spring{std::exp(0.5*(std::log(lo)+std::log(hi))+0.5*u(g)*std::log(hi/lo))});publish_all(s);return s;}
std::string S(double x){char b[40];std::snprintf(b,40,"%.3g",x);return b;}
double size_of(const Structure& s){return s.mass_properties.r.colwise().norm().maxCoeff();}
TEST(B,comb){
  for(unsigned seed=0;seed<3;++seed)for(double f:{0.002,0.005,0.01})for(int du:{1,2}){Clock c;
    Scene s=straight(5,3e4,100,seed);auto S_=st(s);int a=S_->mechanisms.size();
    // bending modes come in pairs y,z
    int l=a,u=a+2*du;double Om=S_->omega[l]+S_->omega[u],w1=S_->omega[a];setrate(s,*S_);
    if(seed==0&&f==0.002){for(int k=0;k<8;++k)std::printf("%g ",S_->omega[a+k]);std::printf("mech %d\n",a);}
    add_mode(s,*S_,l,2e-3,0);
    Load L;L.axes=Axes::kBody;double F=f*S_->mass_properties.mass*S_->omega[l]*S_->omega[u]*1.0;L.forces={{0,Vector3d(F,0,0)}};if(du==2)L.forces.push_back({4,Vector3d(-F,0,0)});L.history=SineHistory{Om/2/M_PI,0};s.loads={L};
    study("straight comb seed"+S(seed)+" f"+S(f)+" du"+S(du),s,40*2*M_PI/w1,{Fidelity::kSeparated},25);
  }}
TEST(B,longring){
  for(unsigned seed=0;seed<6;++seed)for(double amp:{3e-5,1e-4,3e-4}){Clock c;
    Scene s=cloud(5,seed+100);auto S_=st(s);int a=S_->mechanisms.size();double w1=lowest_of(*S_);setrate(s,*S_);
    double z=size_of(*S_);add_mode(s,*S_,a+(seed%2),amp*z,0);if(seed%3)add_mode(s,*S_,a+1+(seed%2),0.3*amp*z,0.2*amp*z*w1);
    study("longring seed"+S(seed)+" amp"+S(amp),s,400*2*M_PI/w1,{Fidelity::kSeparated,Fidelity::kCoupled},25);
  }}
TEST(B,racket){
  for(double ws:{0.05,0.025})for(unsigned seed:{0u,1u}){Clock c;
    Scene s=cloud(5,seed+200);s.damping.modal_ratio=0.05;auto S_=st(s);double w1=lowest_of(*S_);setrate(s,*S_);
    Eigen::Matrix3d J=Eigen::Matrix3d::Zero();const auto& r=S_->mass_properties.r;
    for(int i=0;i<5;++i)J+=s.points[i].mass*(r.col(i).squaredNorm()*Eigen::Matrix3d::Identity()-r.col(i)*r.col(i).transpose());
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> es(J);s.initial.angular_velocity=ws*w1*es.eigenvectors().col(1);
    std::printf("J %g %g %g\n",es.eigenvalues()[0],es.eigenvalues()[1],es.eigenvalues()[2]);
    study("racket w"+S(ws)+" seed"+S(seed),s,50/(ws*w1),{Fidelity::kSpinLoaded,Fidelity::kCoupled},40);
  }}
TEST(B,slowfast){
  for(double kb:{30.,100.,300.})for(double x:{3e-4,1e-3}){Clock c;
    Scene s;s.name="sf";int h1=point(s,100,{-1,0,0}),m=point(s,0.1,{0,0,0}),h2=point(s,100,{1,0,0});
    link(s,{h1,m},Spring{1e3});link(s,{m,h2},Spring{1e3});link(s,{h1,m,h2},BendingSpring{kb});publish_all(s);
    auto S_=st(s);int a=S_->mechanisms.size();if(x==3e-4){for(int k=0;k<S_->omega.size();++k)std::printf("%g ",S_->omega[k]);std::printf("\n");}
    setrate(s,*S_);int soft=a;
    add_mode(s,*S_,soft,x,0);
    // lateral of the light mass along y
    s.initial.points[m].displacement+=Vector3d(0,20*x,0);s.initial.points[h1].displacement-=Vector3d(0,20*x*0.05/100,0);s.initial.points[h2].displacement-=Vector3d(0,20*x*0.05/100,0);
    study("slowfast kb"+S(kb)+" x"+S(x),s,5*2*M_PI/S_->omega[soft],{Fidelity::kSeparated,Fidelity::kCoupled},30);
  }}
TEST(B,dyn){
  // prestress mode driven off resonance, at 2 w1
  for(unsigned seed=0;seed<3;++seed)for(double k:{600.,1000.,1500.})for(double f:{2e-4,1e-3,3e-3}){Clock c;
    Scene s=straight(4,k,100,seed);auto S_=st(s);int a=S_->mechanisms.size();setrate(s,*S_);double w1=S_->omega[a];
    if(f==2e-4){for(int q=0;q<S_->omega.size();++q)std::printf("%g ",S_->omega[q]);std::printf("\n");}
    add_mode(s,*S_,a,1e-3,0);
    Load L;L.axes=Axes::kBody;double F=f*k;L.forces={{0,Vector3d(F,0,0)},{3,Vector3d(-F,0,0)}};L.history=SineHistory{2*w1/2/M_PI,M_PI/2};s.loads={L};
    study("dyn seed"+S(seed)+" k"+S(k)+" f"+S(f),s,25*2*M_PI/w1,{Fidelity::kSeparated,Fidelity::kCoupled},25);
  }}
TEST(B,longer){
  for(unsigned seed:{3u,7u,8u,9u,10u,11u})for(double amp:{3e-4,6e-4}){Clock c;
    Scene s=cloud(5,seed+100);auto S_=st(s);int a=S_->mechanisms.size();double w1=lowest_of(*S_);setrate(s,*S_);
    double z=size_of(*S_);add_mode(s,*S_,a+(seed%2),amp*z,0);if(seed%3)add_mode(s,*S_,a+1+(seed%2),0.3*amp*z,0.2*amp*z*w1);
    study("longer seed"+S(seed)+" amp"+S(amp),s,1000*2*M_PI/w1,{Fidelity::kSeparated},30);
  }}
TEST(Z,tally){std::printf("TALLY scenes %d runs %d runs with false %d words %d good %d false %d silly runs %d\n",tally.scenes,tally.runs,tally.runs_fg,tally.words,tally.good,tally.false_good,tally.silly);}
